"""Panels and menus: what draws the sidebar."""
