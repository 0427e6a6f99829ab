"""What is found out about a case before anything is computed."""
