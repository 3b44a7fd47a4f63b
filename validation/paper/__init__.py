"""The paper: its 28 spectra, what it says of them, and what it does not say."""
