"""Directions: spread evenly, frames across them, and those in which a model rests."""
