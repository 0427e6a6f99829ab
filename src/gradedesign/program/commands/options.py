"""Arguments of the library in a message, by the options that commands have for them.

A message of the library is read in Python too: it says ``overwrite=True``, the command
``--overwrite``.
"""

from __future__ import annotations

import re

_OPTIONS = (
    (re.compile(r"\ballow_outside=True"), "--allow-outside"),
    (re.compile(r"\boverwrite=True"), "--overwrite"),
    (re.compile(r"\bresume=True"), "--resume"),
    (re.compile(r"\bfolder=\.\.\."), "folder with -o"),
    (re.compile(r'\bunits="(\w+)"'), r"--units \1"),
)


def with_options(message: str) -> str:
    """A message of the library, which speaks of arguments, for who typed a command.

    Examples
    --------
    >>> with_options("take another folder=..., or discard what is there with overwrite=True")
    'take another folder with -o, or discard what is there with --overwrite'
    """
    for argument, option in _OPTIONS:
        message = argument.sub(option, message)
    return message
