"""Pages and figures: of a finished run (`site`), of a study (`document`)."""

if __name__ == "reports":  # found in the folder of the sources: it would be a second copy
    raise ImportError("reports is a part of rockcheck: import rockcheck.reports")
