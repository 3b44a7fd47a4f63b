"""Canonical phenomena of rigid contact, each with a certain answer, and the card of an engine."""
