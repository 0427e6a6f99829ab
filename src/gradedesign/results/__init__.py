"""Output of a run: verdict, files, report, log of iterations."""
