//! Puts into a study's folder what its jobs need.

use super::script::{self, Names};
use super::{Array, Request, SlurmError};
use crate::store::durable;
use crate::study::{Config, StudyFolder};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The files of a study's jobs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Installed {
    /// The copy of the running program.
    pub program: PathBuf,
    /// The copy of the configuration.
    pub config: PathBuf,
    /// The scripts of the arrays, in the order of their shares.
    pub arrays: Vec<(PathBuf, Array)>,
    /// The script of the report.
    pub report: PathBuf,
}

/// Copies the running program and the configuration into the study's folder, each under its content's
/// hash, and writes the scripts of a checked request. `command` is the command line, for people.
///
/// Scripts are overwritten: Slurm keeps its own copy of a submitted one. The copies are not.
///
/// # Errors
/// When a file cannot be read or written, a copy has another content than its name says, or a path
/// cannot stand in a script.
pub fn install(
    config: &Config,
    results: &Path,
    request: &Request,
    command: &str,
) -> Result<Installed, SlurmError> {
    let results = std::path::absolute(results).map_err(failed("find", results))?;
    let folder = StudyFolder::of(&results, &config.study.name);
    let (programs, slurm, logs) = (folder.programs(), folder.slurm(), folder.logs());
    // Slurm makes no folder for logs: a job whose log cannot be opened fails without a word.
    for needed in [&programs, &slurm, &logs] {
        fs::create_dir_all(needed).map_err(failed("create", needed))?;
    }
    let running = running_program().map_err(failed("find", Path::new("the running program")))?;
    let content = fs::read(&running).map_err(failed("read", &running))?;
    let program = keep(&programs, "pao-sim", "", &content, Kind::Program)?;
    let content = config.to_toml();
    let config_copy = keep(&slurm, "config", ".toml", content.as_bytes(), Kind::Text)?;
    let names = Names {
        study: &config.study.name,
        program: &program,
        config: &config_copy,
        results: &results,
        folder: folder.path(),
        logs: &logs,
        command,
    };

    let arrays = request.arrays();
    let mut texts = Vec::new();
    for (number, &array) in arrays.iter().enumerate() {
        let name = match arrays.len() {
            1 => "array.sbatch".to_owned(),
            _ => format!("array-{}.sbatch", number + 1),
        };
        let text = script::array(&names, request, array, arrays.len())?;
        texts.push((slurm.join(name), text));
    }
    let report = slurm.join("report.sbatch");
    texts.push((report.clone(), script::report(&names, request)?));
    remove_other_arrays(&slurm, &texts)?;
    for (path, text) in &texts {
        durable::write(path, |out| out.write_all(text.as_bytes()))
            .map_err(failed("write", path))?;
    }
    let paths = texts.into_iter().map(|(path, _)| path);
    Ok(Installed {
        program,
        config: config_copy,
        arrays: paths.zip(arrays).collect(),
        report,
    })
}

/// The file of this process' program, even when another was built in its place since.
fn running_program() -> io::Result<PathBuf> {
    let image = PathBuf::from("/proc/self/exe");
    if image.exists() {
        Ok(image)
    } else {
        std::env::current_exe()
    }
}

#[derive(Clone, Copy)]
enum Kind {
    Program,
    Text,
}

/// Writes `content` as `<stem>-<hash><extension>`, unless it is there.
fn keep(
    folder: &Path,
    stem: &str,
    extension: &str,
    content: &[u8],
    kind: Kind,
) -> Result<PathBuf, SlurmError> {
    let hash = blake3::hash(content).to_hex();
    let path = folder.join(format!("{stem}-{}{extension}", &hash[..16]));
    match fs::read(&path) {
        Ok(there) if there == content => return Ok(path),
        Ok(_) => return Err(SlurmError::Changed { path }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {}
        Err(error) => return Err(failed("read", &path)(error)),
    }
    let written = match kind {
        Kind::Program => durable::write_executable(&path, |out| out.write_all(content)),
        Kind::Text => durable::write(&path, |out| out.write_all(content)),
    };
    written.map_err(failed("write", &path))?;
    Ok(path)
}

/// Removes the arrays' scripts of an earlier request with more arrays, which nobody is to submit.
fn remove_other_arrays(folder: &Path, texts: &[(PathBuf, String)]) -> Result<(), SlurmError> {
    let entries = fs::read_dir(folder).map_err(failed("read", folder))?;
    for entry in entries {
        let path = entry.map_err(failed("read", folder))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let is_array = name.starts_with("array") && name.ends_with(".sbatch");
        if is_array && texts.iter().all(|(kept, _)| *kept != path) {
            fs::remove_file(&path).map_err(failed("remove", &path))?;
        }
    }
    Ok(())
}

/// Words an input or output error.
fn failed(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> SlurmError {
    let path = path.to_owned();
    move |cause| SlurmError::Io {
        action,
        path,
        cause,
    }
}

#[cfg(test)]
mod tests {
    use super::super::request::tests::request;
    use super::*;

    fn smoke() -> Config {
        Config::parse(
            "[study]\nname = \"small\"\n",
            Path::new("small.toml"),
            &|_| None,
        )
        .unwrap()
    }

    #[test]
    fn copies_are_kept_and_old_arrays_removed() {
        let results = tempfile::tempdir().unwrap();
        let mut split = request(5);
        split.max_array_size = 2;
        let first = install(&smoke(), results.path(), &split, "x").unwrap();
        assert_eq!(first.arrays.len(), 3);
        let changed = |path: &Path| path.metadata().unwrap().modified().unwrap();
        let before = changed(&first.program);
        let second = install(&smoke(), results.path(), &request(5), "x").unwrap();
        assert_eq!(
            (&second.program, &second.config),
            (&first.program, &first.config)
        );
        assert_eq!(changed(&second.program), before);
        let slurm = StudyFolder::of(results.path(), "small").slurm();
        let mut names: Vec<_> = fs::read_dir(slurm)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        assert_eq!(names[0], "array.sbatch");
        assert!(names[1].starts_with("config-"), "{names:?}");
        assert_eq!(names[2..], ["report.sbatch"]);
        let kept = Config::read(&second.config).unwrap();
        assert_eq!(kept, smoke());
    }

    #[test]
    fn a_copy_with_another_content_is_refused() {
        let results = tempfile::tempdir().unwrap();
        let installed = install(&smoke(), results.path(), &request(1), "x").unwrap();
        fs::write(&installed.config, "other").unwrap();
        let refused = install(&smoke(), results.path(), &request(1), "x").unwrap_err();
        assert!(
            refused.to_string().contains("its content was changed"),
            "{refused}"
        );
    }

    #[cfg(unix)]
    #[test]
    fn the_copy_of_the_program_can_be_executed() {
        use std::os::unix::fs::PermissionsExt;
        let results = tempfile::tempdir().unwrap();
        let installed = install(&smoke(), results.path(), &request(1), "x").unwrap();
        let mode = installed.program.metadata().unwrap().permissions().mode();
        assert_eq!(mode & 0o100, 0o100, "{mode:o}");
        let content = fs::read(std::env::current_exe().unwrap()).unwrap();
        assert_eq!(fs::read(&installed.program).unwrap(), content);
    }
}
