"""From a case to a judged design: the only wing that sees a case."""
