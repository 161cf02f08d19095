//! The built-in lessons.

macro_rules! library {
    ($($name:literal)+) => {
        /// The built-in lessons by name, as text; those of `config/lessons/`.
        pub const LIBRARY: &[(&str, &str)] =
            &[$(($name, include_str!(concat!("../../../../config/lessons/", $name, ".toml")))),+];
    };
}

library!(
    "task1" "task2" "task3" "task4" "behind_his_back" "from_the_side" "two_teachers" "a_slip"
    "the_button" "you_do_not_know_that_i_saw"
    "a_task_in_a_task" "three_of_them" "the_far_ones" "stacking" "giving" "misunderstandings"
);

/// Task 1 of the paper.
pub(super) const TASK_1: &str = include_str!("../../../../config/lessons/task1.toml");

/// The lessons of the paper's study, Tasks 1 to 4, as text.
pub const STUDY: [&str; 4] = [
    TASK_1,
    include_str!("../../../../config/lessons/task2.toml"),
    include_str!("../../../../config/lessons/task3.toml"),
    include_str!("../../../../config/lessons/task4.toml"),
];
