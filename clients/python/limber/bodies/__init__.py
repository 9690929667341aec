"""Elastic bodies: motions edited in space and time."""
