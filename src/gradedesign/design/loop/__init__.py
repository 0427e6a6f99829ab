"""The design loop: size, build, analyse, learn, accept, end.

Door: `DesignIteration`, `Stages`, `run_loop`, `Accepted`, `Announcer`.
"""
