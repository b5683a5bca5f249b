"""Plants and litter on the ground under feet: where and when they are trampled, and how they bend and rise again."""
