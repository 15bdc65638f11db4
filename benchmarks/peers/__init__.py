"""The other sides of a comparison: MuJoCo, panda-gym, and this project at other commits."""
