"""Reads rigs, their skin and objects that print, frame by frame."""
