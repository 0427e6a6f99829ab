"""From a judged design to its user: plugins, run folder, pictures, files, commands."""
