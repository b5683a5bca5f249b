"""Rigs before they are read: the roles of their bones, their rest pose, their range of frames."""
