"""Pictures: scenes, marks and drawing."""
