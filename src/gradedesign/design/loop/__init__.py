"""The design loop: size, build, analyse, learn, accept, end."""
