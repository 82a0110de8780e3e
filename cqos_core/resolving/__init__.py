"""Texts become values: profiles, presets, overlays, participants, options and defaults, each value with its origin.

`resolver.Resolver` does all of it.
"""
