//! The text of the job scripts.

use super::quoting::{file_pattern, path_text, sbatch, shell};
use super::{Array, Request, SlurmError};
use std::path::Path;

/// What the scripts of a study name. Every path is absolute.
#[derive(Clone, Copy, Debug)]
pub struct Names<'a> {
    pub study: &'a str,
    /// The copy of the program.
    pub program: &'a Path,
    /// The copy of the configuration.
    pub config: &'a Path,
    /// Folder of all studies' results.
    pub results: &'a Path,
    /// The study's own folder in it.
    pub folder: &'a Path,
    /// The study's logs.
    pub logs: &'a Path,
    /// The command line that the scripts come from, for people.
    pub command: &'a str,
}

/// The script of one of `of` arrays.
///
/// # Errors
/// When a path cannot stand in a script.
pub fn array(
    names: &Names,
    request: &Request,
    array: Array,
    of: usize,
) -> Result<String, SlurmError> {
    let (tasks, shares) = (request.tasks, array.shares());
    let head = match of {
        1 => format!("Study {}: {tasks} tasks, each one share.", names.study),
        _ => format!(
            "Study {}: {tasks} tasks, each one share; here shares {} to {}.",
            names.study,
            shares.start(),
            shares.end()
        ),
    };
    let mut script = header(names, &head);
    option(&mut script, "job-name", &job_name(names.study));
    let at_once = request.max_running.map(|k| format!("%{k}"));
    let indices = format!("0-{}{}", array.tasks - 1, at_once.unwrap_or_default());
    option(&mut script, "array", &indices);
    resources(&mut script, request, request.cpus);
    script += "# USR1 goes to the script's own process, which the program takes over (exec, below): it stops softly.\n";
    let margin = request.margin.seconds();
    option(&mut script, "signal", &format!("B:USR1@{margin}"));
    restart(&mut script, names, "%A_%a")?;
    further(&mut script, request);
    script += &format!(
        "\nexec {} \\\n    --results {} \\\n    run {} \\\n",
        word(names.program)?,
        word(names.results)?,
        word(names.config)?
    );
    script += &format!(
        "    --shard \"$((${{SLURM_ARRAY_TASK_ID:?submit this script with sbatch}} + {}))/{tasks}\" \\\n",
        array.first
    );
    script += "    --threads \"$SLURM_CPUS_PER_TASK\"";
    for argument in &request.run {
        script += &format!(" {}", shell(argument));
    }
    Ok(script + "\n")
}

/// The script of the report that follows the arrays.
///
/// # Errors
/// When a path cannot stand in a script.
pub fn report(names: &Names, request: &Request) -> Result<String, SlurmError> {
    let head = format!(
        "Study {}: the tables and figures of whatever is there.",
        names.study
    );
    let mut script = header(names, &head);
    let name = format!("{}-report", job_name(names.study));
    option(&mut script, "job-name", &name);
    resources(&mut script, request, 1);
    restart(&mut script, names, "%j-report")?;
    further(&mut script, request);
    let (program, folder) = (word(names.program)?, word(names.folder)?);
    script += &format!("\n{program} report {folder}\nreported=$?\n{program} status {folder}\n");
    let advice = format!("what is left, this continues: {}", names.command);
    script += &format!("echo {}\nexit $reported\n", shell(&advice));
    Ok(script)
}

/// The name of a study's jobs.
pub fn job_name(study: &str) -> String {
    format!("pao-sim-{study}")
}

fn header(names: &Names, head: &str) -> String {
    format!(
        "#!/bin/bash\n# {head} Written by\n#     {}\n# which, given again, writes this anew and continues the study with any number of tasks.\n",
        names.command
    )
}

fn option(script: &mut String, name: &str, value: &str) {
    *script += &format!("#SBATCH --{name}={value}\n");
}

fn resources(script: &mut String, request: &Request, cpus: u32) {
    option(script, "nodes", "1");
    option(script, "ntasks", "1");
    option(script, "cpus-per-task", &cpus.to_string());
    if let Some(time) = request.time {
        option(script, "time", &time.to_string());
    }
    let texts = [
        ("mem", &request.memory),
        ("partition", &request.partition),
        ("account", &request.account),
        ("qos", &request.qos),
        ("constraint", &request.constraint),
    ];
    for (name, text) in texts {
        if let Some(text) = text {
            option(script, name, &sbatch(text));
        }
    }
}

fn restart(script: &mut String, names: &Names, job: &str) -> Result<(), SlurmError> {
    *script += "# After a node's failure or a preemption Slurm starts it again; it goes on, and so does its log.\n";
    *script += "#SBATCH --requeue\n";
    option(script, "open-mode", "append");
    let logs = file_pattern(path_text(names.logs)?);
    let log = format!("{logs}/slurm-{job}.log");
    option(script, "output", &sbatch(&log));
    Ok(())
}

fn further(script: &mut String, request: &Request) {
    for line in &request.lines {
        *script += &format!("#SBATCH {line}\n");
    }
}

fn word(path: &Path) -> Result<String, SlurmError> {
    Ok(shell(path_text(path)?))
}

#[cfg(test)]
mod tests {
    use super::super::request::tests::request;
    use super::*;

    fn names<'a>(results: &'a Path, paths: &'a [std::path::PathBuf; 4]) -> Names<'a> {
        Names {
            study: "full",
            program: &paths[0],
            config: &paths[1],
            results,
            folder: &paths[2],
            logs: &paths[3],
            command: "pao-sim slurm configs/full.toml --tasks 4",
        }
    }

    fn paths(results: &Path) -> [std::path::PathBuf; 4] {
        let folder = results.join("full");
        [
            folder.join("bin/pao-sim-0123456789abcdef"),
            folder.join("slurm/config-0123456789abcdef.toml"),
            folder.clone(),
            folder.join("logs"),
        ]
    }

    #[test]
    fn an_array_and_its_report() {
        let results = Path::new("/scratch/ada/results");
        let paths = paths(results);
        let (names, request) = (names(results, &paths), request(4));
        let [only] = request.arrays()[..] else {
            panic!("one array holds 4 tasks")
        };
        insta::assert_snapshot!("array", array(&names, &request, only, 1).unwrap());
        insta::assert_snapshot!("report", report(&names, &request).unwrap());
    }

    #[test]
    fn a_split_array_with_every_option_and_a_difficult_path() {
        let results = Path::new("/scratch/Ada's 100% \"new\" results");
        let paths = paths(results);
        let mut request = request(2500);
        let text = |text: &str| Some(text.to_owned());
        request.memory = text("8G");
        request.partition = text("long,short");
        request.account = text("hip surgery");
        request.qos = text("normal");
        request.constraint = text("[skylake|icelake]&avx512");
        request.max_running = Some(50);
        request.lines = vec!["--mail-type=END --mail-user=ada@example.org".into()];
        request.run = vec!["--accept".into(), "study.description".into()];
        let arrays = request.arrays();
        let names = names(results, &paths);
        let last = *arrays.last().unwrap();
        let script = array(&names, &request, last, arrays.len()).unwrap();
        insta::assert_snapshot!("split_array", script);
        insta::assert_snapshot!("full_report", report(&names, &request).unwrap());
    }

    #[test]
    fn a_path_that_would_end_a_line_is_refused() {
        let results = Path::new("/scratch/a\nb");
        let paths = paths(results);
        let (names, request) = (names(results, &paths), request(1));
        let error = array(&names, &request, request.arrays()[0], 1).unwrap_err();
        assert!(
            error.to_string().contains(r#""/scratch/a\nb/full"#),
            "{error}"
        );
    }
}
