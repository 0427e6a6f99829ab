"""``python -m gradedesign``."""

from gradedesign.cli import main

if __name__ == "__main__":
    main()
