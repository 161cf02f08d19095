//! What Leo has learned, in one transactional file.
