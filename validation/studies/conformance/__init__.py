"""Canonical phenomena of rigid contact, each with a certain answer, and the card that an engine
gets.
"""
