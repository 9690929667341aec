"""Structures of beams that bend far."""
