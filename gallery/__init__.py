"""Pictures of the docs: scenes out of doors, sheets of the grounds, moving pictures, the icon, the pictures of presets.

They stand on `sample_scenes`, and nothing stands on them: neither the extension nor the tests of other folders.
"""
