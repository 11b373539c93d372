"""The demonstrator's body: bones, arm, skin."""
