//! Learning from a teacher: actions, schemas, goals, hypotheses.
