"""The ground solver: from a contact to its imprint, compression, rim and slides."""
