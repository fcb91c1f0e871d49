//! One case: perturb, move, wires, warp, views, fluoroscopy, picks, annotations. Holds the truth.
