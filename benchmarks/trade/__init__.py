"""The trade of speed for accuracy: scenes, settings of both engines, errors, costs, their page."""
