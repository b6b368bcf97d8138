"""The printed report of a model (``mechc report``): what stands in it, as blocks, and the writers of HTML and PDF."""
