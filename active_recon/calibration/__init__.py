"""
Calibration: where a camera stands around the object, from images of a ChArUco board.

The board's frame is OpenCV's: its origin is the board's outer corner, x runs along a row of
squares, y along a column, z into the paper. All else is as in `active_recon.geometry.cameras`.
"""
