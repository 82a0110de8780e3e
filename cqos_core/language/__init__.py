"""Policies and conditions: build, parse, print, evaluate and solve them, without knowing any protocol."""
