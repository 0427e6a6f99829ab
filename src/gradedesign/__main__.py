"""``python -m gradedesign``."""

from gradedesign.program.commands import main

if __name__ == "__main__":
    main()
