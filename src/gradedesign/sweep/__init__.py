"""Studies: many designs of one case, each an ordinary run, into one table and one plot."""
