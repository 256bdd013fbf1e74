//! Index of the task that this process runs, from an argument or from the engine that started it.

use std::{fmt, str::FromStr};

use super::Variables;

/// `--task`: `3/32`, `env` or `env/32`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskChoice {
    /// Task `task`, counted from 0, of `tasks`.
    Given {
        /// Which.
        task: u32,
        /// Number of tasks in all.
        tasks: u32,
    },
    /// Task from the engine's variables; of `tasks`, where the argument gives their number.
    Environment {
        /// Number of tasks in all.
        tasks: Option<u32>,
    },
}

/// Which task this is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TaskFound {
    /// Which, counted from 0.
    pub task: u32,
    /// Number of tasks in all.
    pub tasks: u32,
    /// Variable with the index and its value; `None` if the argument gave it.
    pub from: Option<String>,
}

/// Why it is not known which task this is.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TaskError {
    /// Not of the form of a task.
    #[error("'{text}' is not a task; expected I/N with I from 0 to N - 1, `env`, or `env/N`")]
    Syntax {
        /// Text given.
        text: String,
    },
    /// No engine's variable is set.
    #[error("no engine's variable is set ({known}); give --task I/N")]
    NoVariable {
        /// Variables that were searched.
        known: String,
    },
    /// A variable that holds no number.
    #[error("{variable}={value} is not a number")]
    NoNumber {
        /// The variable.
        variable: &'static str,
        /// Value of the variable.
        value: String,
    },
    /// A number without a count.
    #[error("{found} gives the index of this task but not the number of tasks{because}; give --task env/N")]
    NoCount {
        /// The variable, with its value.
        found: String,
        /// Why not.
        because: String,
    },
    /// A number that is no task.
    #[error("{found} is task {task}, but tasks are numbered from 0 to {last}; number the array from {first}")]
    OutOfRange {
        /// The variable, with its value.
        found: String,
        /// The task that it means.
        task: i64,
        /// The last task.
        last: u32,
        /// Where this engine's array should begin.
        first: u32,
    },
    /// Two engines disagree.
    #[error("{first} gives task {}, {second} gives task {}; unset one of them, or give --task I/N", tasks.0, tasks.1)]
    Disagree {
        /// A variable, with its value.
        first: String,
        /// Another.
        second: String,
        /// Tasks that they state, as I/N.
        tasks: (String, String),
    },
}

impl FromStr for TaskChoice {
    type Err = TaskError;

    fn from_str(text: &str) -> Result<Self, TaskError> {
        let wrong = || TaskError::Syntax { text: text.to_owned() };
        let number = |text: &str| text.parse::<u32>().map_err(|_| wrong());
        let choice = match text.split_once('/') {
            None if text == "env" => Self::Environment { tasks: None },
            Some(("env", tasks)) => Self::Environment { tasks: Some(number(tasks)?) },
            Some((task, tasks)) => Self::Given { task: number(task)?, tasks: number(tasks)? },
            None => return Err(wrong()),
        };
        let sound = match choice {
            Self::Given { task, tasks } => task < tasks,
            Self::Environment { tasks } => tasks != Some(0),
        };
        if sound { Ok(choice) } else { Err(wrong()) }
    }
}

impl TaskChoice {
    /// Which task it is in this environment.
    ///
    /// # Errors
    /// When engines' variables are missing, incomplete or contradictory.
    pub fn find(self, variables: Variables) -> Result<TaskFound, TaskError> {
        let tasks = match self {
            Self::Given { task, tasks } => return Ok(TaskFound { task, tasks, from: None }),
            Self::Environment { tasks } => tasks,
        };
        let mut found: Option<TaskFound> = None;
        for engine in ENGINES {
            let Some(other) = engine.find(tasks, variables)? else { continue };
            match &found {
                None => found = Some(other),
                Some(first) if (first.task, first.tasks) == (other.task, other.tasks) => {}
                Some(first) => {
                    let words = |found: &TaskFound| format!("{}/{}", found.task, found.tasks);
                    return Err(TaskError::Disagree {
                        first: first.from.clone().unwrap_or_default(),
                        tasks: (words(first), words(&other)),
                        second: other.from.unwrap_or_default(),
                    });
                }
            }
        }
        let known = || ENGINES.iter().map(|engine| engine.number).collect::<Vec<_>>().join(", ");
        found.ok_or_else(|| TaskError::NoVariable { known: known() })
    }
}

/// Variables that an engine sets in the environment of a task of an array.
struct Engine {
    /// The task's number.
    number: &'static str,
    /// A value that means that there is no array.
    none: Option<&'static str>,
    /// Number of the first task: an array that the user numbers begins at 0, others where the engine does.
    first: u32,
    /// Number of tasks.
    count: Count,
}

enum Count {
    /// Not stated.
    Untold,
    /// A separate variable; numbers begin at `first`.
    Variable(&'static str),
    /// Variables of the first number, the last and the step: all numbers in between exist.
    Span { first: &'static str, last: &'static str, step: &'static str },
}

/// Slurm, Kubernetes (Indexed Job), AWS Batch, Google Cloud Run jobs, HyperQueue, PBS Professional and OpenPBS, TORQUE, Grid
/// Engine, LSF, GNU parallel; names as their manuals have them.
const ENGINES: &[Engine] = &[
    Engine {
        number: "SLURM_ARRAY_TASK_ID",
        none: None,
        first: 0,
        count: Count::Span {
            first: "SLURM_ARRAY_TASK_MIN",
            last: "SLURM_ARRAY_TASK_MAX",
            step: "SLURM_ARRAY_TASK_STEP",
        },
    },
    Engine { number: "JOB_COMPLETION_INDEX", none: None, first: 0, count: Count::Untold },
    Engine {
        number: "AWS_BATCH_JOB_ARRAY_INDEX",
        none: None,
        first: 0,
        count: Count::Variable("AWS_BATCH_JOB_ARRAY_SIZE"),
    },
    Engine { number: "CLOUD_RUN_TASK_INDEX", none: None, first: 0, count: Count::Variable("CLOUD_RUN_TASK_COUNT") },
    Engine { number: "HQ_TASK_ID", none: None, first: 0, count: Count::Untold },
    Engine { number: "PBS_ARRAY_INDEX", none: None, first: 0, count: Count::Untold },
    Engine { number: "PBS_ARRAYID", none: None, first: 0, count: Count::Untold },
    Engine {
        number: "SGE_TASK_ID",
        none: Some("undefined"),
        // Grid Engine has no task 0.
        first: 1,
        count: Count::Span { first: "SGE_TASK_FIRST", last: "SGE_TASK_LAST", step: "SGE_TASK_STEPSIZE" },
    },
    // 0 outside an array: LSF counts from 1.
    Engine { number: "LSB_JOBINDEX", none: Some("0"), first: 1, count: Count::Untold },
    Engine { number: "PARALLEL_SEQ", none: None, first: 1, count: Count::Untold },
];

impl Engine {
    /// The task that this engine names, if it names one. With `tasks` from the argument, the number counts from the
    /// engine's first, also if only a part of the array was submitted again.
    fn find(&self, tasks: Option<u32>, variables: Variables) -> Result<Option<TaskFound>, TaskError> {
        let Some(value) = variables(self.number).filter(|value| Some(value.as_str()) != self.none) else {
            return Ok(None);
        };
        let found = format!("{}={value}", self.number);
        let number = read(self.number, &value)?;
        let (task, tasks) = match tasks {
            Some(tasks) => (number - i64::from(self.first), tasks),
            None => self.counted(number, &found, variables)?,
        };
        match u32::try_from(task) {
            Ok(task) if task < tasks => Ok(Some(TaskFound { task, tasks, from: Some(found) })),
            _ => Err(TaskError::OutOfRange { found, task, last: tasks.saturating_sub(1), first: self.first }),
        }
    }

    /// Task and count by the engine's own variables.
    fn counted(&self, number: i64, found: &str, variables: Variables) -> Result<(i64, u32), TaskError> {
        let no_count = |because: String| TaskError::NoCount { found: found.to_owned(), because };
        let value = |name: &'static str| -> Result<i64, TaskError> {
            let value = variables(name).ok_or_else(|| no_count(format!(" ({name} is not set)")))?;
            read(name, &value)
        };
        match &self.count {
            Count::Untold => Err(no_count(String::new())),
            Count::Variable(name) => Ok((number - i64::from(self.first), u32::try_from(value(name)?).unwrap_or(0))),
            Count::Span { first, last, step } => {
                let (low, high) = (value(first)?, value(last)?);
                let name = *step;
                let step = variables(name).map_or(Ok(1), |value| read(name, &value))?;
                if step < 1 {
                    return Err(no_count(format!(" ({name}={step} is no step)")));
                }
                let tasks = (high - low) / step + 1;
                // Slurm states their number: smaller where an array has gaps, such as one that submits some tasks
                // again.
                if let Some(count) = variables("SLURM_ARRAY_TASK_COUNT").filter(|_| self.number.starts_with("SLURM")) {
                    let count = read("SLURM_ARRAY_TASK_COUNT", &count)?;
                    if count != tasks {
                        return Err(no_count(format!(" (an array of {count} with gaps between {low} and {high})")));
                    }
                }
                Ok(((number - low) / step, u32::try_from(tasks).unwrap_or(0)))
            }
        }
    }
}

fn read(variable: &'static str, value: &str) -> Result<i64, TaskError> {
    value.trim().parse().map_err(|_| TaskError::NoNumber { variable, value: value.to_owned() })
}

impl fmt::Display for TaskFound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "task {} of {}", self.task, self.tasks)?;
        self.from.as_ref().map_or(Ok(()), |from| write!(f, " ({from})"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn find(choice: &str, set: &[(&str, &str)]) -> Result<(u32, u32), TaskError> {
        let variables = |name: &str| set.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned());
        let found = choice.parse::<TaskChoice>()?.find(&variables)?;
        Ok((found.task, found.tasks))
    }

    #[test]
    fn an_argument_says_it() {
        assert_eq!(find("3/32", &[]), Ok((3, 32)));
        // Nothing else is read.
        assert_eq!(find("3/32", &[("SLURM_ARRAY_TASK_ID", "7")]), Ok((3, 32)));
        for wrong in ["32/32", "1", "0/0", "-1/3", "env/0", "env/x", "", "1/2/3"] {
            assert_eq!(find(wrong, &[]), Err(TaskError::Syntax { text: wrong.to_owned() }), "{wrong}");
        }
    }

    #[test]
    fn engines_say_it() {
        let slurm = |id, min, max, step, count| {
            [
                ("SLURM_ARRAY_TASK_ID", id),
                ("SLURM_ARRAY_TASK_MIN", min),
                ("SLURM_ARRAY_TASK_MAX", max),
                ("SLURM_ARRAY_TASK_STEP", step),
                ("SLURM_ARRAY_TASK_COUNT", count),
            ]
        };
        assert_eq!(find("env", &slurm("5", "0", "31", "1", "32")), Ok((5, 32)));
        assert_eq!(find("env", &slurm("5", "1", "32", "1", "32")), Ok((4, 32)));
        assert_eq!(find("env", &slurm("9", "1", "32", "4", "8")), Ok((2, 8)));
        assert_eq!(find("env/64", &slurm("17", "3", "19", "1", "4")), Ok((17, 64)));
        assert_eq!(find("env/32", &[("JOB_COMPLETION_INDEX", "31")]), Ok((31, 32)));
        assert_eq!(find("env", &[("AWS_BATCH_JOB_ARRAY_INDEX", "2"), ("AWS_BATCH_JOB_ARRAY_SIZE", "9")]), Ok((2, 9)));
        assert_eq!(find("env", &[("CLOUD_RUN_TASK_INDEX", "0"), ("CLOUD_RUN_TASK_COUNT", "4")]), Ok((0, 4)));
        assert_eq!(find("env/4", &[("HQ_TASK_ID", "3")]), Ok((3, 4)));
        assert_eq!(find("env/4", &[("PBS_ARRAY_INDEX", "3")]), Ok((3, 4)));
        assert_eq!(find("env/4", &[("PARALLEL_SEQ", "4")]), Ok((3, 4)));
        assert_eq!(find("env/4", &[("LSB_JOBINDEX", "1")]), Ok((0, 4)));
        let grid = [("SGE_TASK_ID", "3"), ("SGE_TASK_FIRST", "1"), ("SGE_TASK_LAST", "8"), ("SGE_TASK_STEPSIZE", "1")];
        assert_eq!(find("env", &grid), Ok((2, 8)));
        // Two that agree are one.
        assert_eq!(find("env/4", &[("HQ_TASK_ID", "3"), ("PARALLEL_SEQ", "4")]), Ok((3, 4)));
    }

    #[test]
    fn doubt_is_refused() {
        let no_count = |set: &[(&str, &str)]| matches!(find("env", set), Err(TaskError::NoCount { .. }));
        assert!(no_count(&[("JOB_COMPLETION_INDEX", "3")]));
        assert!(no_count(&[("SLURM_ARRAY_TASK_ID", "3")]));
        assert!(no_count(&[
            ("SLURM_ARRAY_TASK_ID", "3"),
            ("SLURM_ARRAY_TASK_MIN", "3"),
            ("SLURM_ARRAY_TASK_MAX", "19"),
            ("SLURM_ARRAY_TASK_COUNT", "4"),
        ]));
        for step in ["0", "-1"] {
            assert!(no_count(&[
                ("SLURM_ARRAY_TASK_ID", "3"),
                ("SLURM_ARRAY_TASK_MIN", "3"),
                ("SLURM_ARRAY_TASK_MAX", "19"),
                ("SLURM_ARRAY_TASK_STEP", step),
            ]));
        }
        let nothing = find("env", &[("SGE_TASK_ID", "undefined"), ("LSB_JOBINDEX", "0")]);
        assert!(matches!(nothing, Err(TaskError::NoVariable { .. })), "{nothing:?}");
        let other = find("env/4", &[("SLURM_ARRAY_TASK_ID", "1"), ("PARALLEL_SEQ", "1")]);
        assert!(matches!(&other, Err(TaskError::Disagree { tasks, .. }) if *tasks == ("1/4".into(), "0/4".into())));
        assert!(matches!(find("env/4", &[("HQ_TASK_ID", "4")]), Err(TaskError::OutOfRange { task: 4, last: 3, .. })));
        assert!(matches!(find("env/4", &[("PARALLEL_SEQ", "0")]), Err(TaskError::OutOfRange { task: -1, .. })));
        assert!(matches!(find("env/4", &[("HQ_TASK_ID", "x")]), Err(TaskError::NoNumber { .. })));
    }
}
