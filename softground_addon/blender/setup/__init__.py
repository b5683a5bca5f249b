"""The setup of a shot: its characters and grounds, and a sample for those who have none."""
