"""Where models run: workers, clusters, the store of results, and what a result depends on."""
