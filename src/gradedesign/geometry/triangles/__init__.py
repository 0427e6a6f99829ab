"""Closed triangle surfaces and the questions asked of them: closest point, rays, inside."""
