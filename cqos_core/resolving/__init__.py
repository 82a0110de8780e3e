"""Texts become values: profiles, presets, overlays, participants, options and defaults, each value with its origin.

`resolve.Resolver` does all of it.
"""
