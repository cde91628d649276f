"""The filters written plainly, for comparison: what the fast ones must equal, and beat."""
