"""What a run leaves behind: verdict, files, report, log of iterations."""
