//! The numbers that the paper prints.

use super::trial::Rmse;

/// A table of the paper, root mean square errors by start and law: rows are P1 to P4; in each the proportional law, then the
/// nonlinear one; in each R (cm), theta, alpha (rad).
pub type PrintedTable = [[Rmse; 2]; 4];

/// Table I, accurate bearings.
pub const TABLE_I: PrintedTable = [
    [[0.03680, 0.0497, 1.7229e-16], [0.008, 5.077e-4, 0.0]],
    [[0.01672, 0.0073, 2.0192e-16], [4.0831e-4, 4.4109e-5, 0.0]],
    [[1.6756e-4, 3.5633e-5, 5.4060e-16], [9.6656e-5, 3.6028e-5, 9.8646e-17]],
    [[5.0917e-4, 1.1741e-4, 4.0341e-16], [4.0893e-4, 5.5575e-5, 5.4664e-17]],
];

/// Table II, bearings from the images of the paper's own set.
pub const TABLE_II: PrintedTable = [
    [[0.0101, 0.0472, 1.2678e-16], [0.0343, 0.0252, 0.0]],
    [[0.08, 0.06, 3.0192e-16], [0.035, 0.012, 0.0]],
    [[0.0121, 0.0123, 2.6564e-17], [0.0412, 0.0236, 7.0217e-18]],
    [[0.1531, 0.0293, 2.0472e-17], [0.0249, 0.0137, 1.9910e-16]],
];
