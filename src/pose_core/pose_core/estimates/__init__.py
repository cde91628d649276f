"""What estimators are given, observations, and what they give: poses with their uncertainty."""
