"""Live pages: a model and its kernel as WebAssembly in one file, with its picture, curves and sliders."""
