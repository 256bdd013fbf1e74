"""Trains networks that complete shapes or find grasps in images:
``python -m graspmill.train RECIPE.toml --data DIR --out RUN``.

Needs PyTorch and, for the model that comes out, onnx, onnxscript, onnxruntime and matplotlib (``pip install
graspmill[train]``). The only part of this package that writes. See docs/training.md.
"""
