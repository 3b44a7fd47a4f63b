"""What each command costs a person who waits for it (`rockcheck benchmark commands`)."""
