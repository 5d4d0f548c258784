//! Counting what the rows of a study say.
