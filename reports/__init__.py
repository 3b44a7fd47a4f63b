"""Pages and figures: of a finished run (`site`), of a study (`document`)."""
