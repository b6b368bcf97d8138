"""What notebooks show of models, motions and answers, and the cells that hold models (``%load_ext mechc``)."""
