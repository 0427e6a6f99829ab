"""What few cells across a wall do to stiffness and strength."""
