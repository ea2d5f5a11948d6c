//! A PostgreSQL of our own, started once for all tests that need one: found in the usual places, its data in a folder of its
//! own, gone with the process. `RAILHEAD_TEST_POSTGRES` names the URL of another one, of a role that may make databases.

use std::io::Read;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use railhead::jobs::store::postgres::schema::migrate;

use crate::support::skip;

/// How long the server may take to start.
const STARTS_WITHIN: Duration = Duration::from_secs(60);

struct Server {
    url: String,
    /// The server ends with the standard input of this shell, however this process ends.
    _shell: Option<Child>,
}

/// URL of a server; `None`, said aloud, if there is none on this machine.
pub fn server() -> Option<&'static str> {
    static SERVER: OnceLock<Option<Server>> = OnceLock::new();
    let server = SERVER.get_or_init(|| match std::env::var("RAILHEAD_TEST_POSTGRES") {
        Ok(url) => Some(Server { url, _shell: None }),
        Err(_) => start(),
    });
    if server.is_none() {
        skip("there is no PostgreSQL here (Debian: apt-get install postgresql)");
    }
    server.as_ref().map(|server| server.url.as_str())
}

/// A database of its own in that server.
pub async fn database() -> Option<String> {
    static MADE: AtomicU32 = AtomicU32::new(0);
    let url = server()?;
    let number = MADE.fetch_add(1, Ordering::Relaxed);
    let name = format!("test_{}_{number}", std::process::id());
    let pool = sqlx::PgPool::connect(url).await.expect("the server");
    let statement = format!("CREATE DATABASE {name}");
    sqlx::query(sqlx::AssertSqlSafe(statement))
        .execute(&pool)
        .await
        .expect("a database");
    pool.close().await;
    let (front, _) = url.rsplit_once('/').expect("a URL with a database");
    Some(format!("{front}/{name}"))
}

/// A schema of its own with the tables of the service, which is made faster than a database.
pub async fn schema() -> Option<String> {
    static MADE: AtomicU32 = AtomicU32::new(0);
    let url = server()?;
    let number = MADE.fetch_add(1, Ordering::Relaxed);
    let name = format!("test_{}_{number}", std::process::id());
    let pool = sqlx::PgPool::connect(url).await.expect("the server");
    let statement = format!("CREATE SCHEMA {name}");
    sqlx::query(sqlx::AssertSqlSafe(statement))
        .execute(&pool)
        .await
        .expect("a schema");
    pool.close().await;
    let url = format!("{url}?options=-c%20search_path%3D{name}");
    migrate(&url).await.expect("tables");
    Some(url)
}

/// The folder of the programs.
fn programs() -> Option<PathBuf> {
    let there = |folder: &PathBuf| folder.join("initdb").is_file();
    let mut folders: Vec<PathBuf> = std::fs::read_dir("/usr/lib/postgresql")
        .into_iter()
        .flatten()
        .filter_map(|version| Some(version.ok()?.path().join("bin")))
        .collect();
    folders.sort();
    folders.reverse();
    let path = std::env::var_os("PATH").unwrap_or_default();
    folders.extend(std::env::split_paths(&path));
    folders.into_iter().find(there)
}

/// A shell as somebody that the server runs for, which it refuses for root. There is a user for it where it was installed as a
/// package; inside a namespace that has no other user than root, another name for that one does.
fn shell(folder: &Path) -> Command {
    let read = |file: &str| std::fs::read_to_string(file).unwrap_or_default();
    let root = read("/proc/self/status")
        .lines()
        .any(|line| line.starts_with("Uid:\t0\t"));
    if !root {
        return Command::new("sh");
    }
    let alone = read("/proc/self/uid_map").split_whitespace().nth(2) == Some("1");
    if alone {
        let mut command = Command::new("unshare");
        command.args(["--user", "--map-user=65534", "--map-group=65534", "sh"]);
        return command;
    }
    let users = read("/etc/passwd");
    let entry = |name: &str| users.lines().find(|line| line.starts_with(name));
    let user = entry("postgres:").or_else(|| entry("nobody:"));
    let mut numbers = user
        .expect("a user that is not root")
        .split(':')
        .skip(2)
        .map(|number| number.parse().expect("a number"));
    let (uid, gid) = (numbers.next(), numbers.next());
    std::os::unix::fs::chown(folder, uid, gid).expect("the folder changes hands");
    let mut command = Command::new("sh");
    command.uid(uid.expect("uid")).gid(gid.expect("gid"));
    command
}

fn start() -> Option<Server> {
    let programs = programs()?;
    let folder = tempfile::Builder::new()
        .prefix("railhead-pg")
        .tempdir()
        .expect("a folder")
        .keep();
    let port = std::net::TcpListener::bind("127.0.0.1:0")
        .and_then(|listener| listener.local_addr())
        .expect("a port")
        .port();
    // It ends as soon as its standard input does, and takes its data with it.
    let script = format!(
        "cd '{data}' && '{bin}/initdb' -D db -U railhead -A trust -E UTF8 --no-locale -N > init.log 2>&1 && \
         {{ '{bin}/postgres' -D db -k '{data}' -c listen_addresses=127.0.0.1 -p {port} -c fsync=off \
         -c max_connections=400 -c shared_buffers=64MB -c deadlock_timeout=200ms > log 2>&1 & }} && echo started && \
         read nothing; kill -QUIT $!; wait; rm -rf '{data}'",
        data = folder.display(),
        bin = programs.display(),
    );
    let mut command = shell(&folder);
    command
        .args(["-c", &script])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped());
    let mut child: Child = command.spawn().expect("a shell");
    let mut started = [0];
    let heard = child.stdout.take().map(|mut out| out.read(&mut started));
    assert!(
        matches!(heard, Some(Ok(1))),
        "initdb failed in {}",
        folder.display()
    );
    let url = format!("postgres://railhead@127.0.0.1:{port}/postgres");
    let until = Instant::now() + STARTS_WITHIN;
    let ready = || {
        let mut asked = Command::new(programs.join("pg_isready"));
        asked.args(["-q", "-h", "127.0.0.1", "-p", &port.to_string()]);
        asked.status().is_ok_and(|status| status.success())
    };
    while !ready() {
        assert!(
            Instant::now() < until,
            "no PostgreSQL in {}",
            folder.display()
        );
        std::thread::sleep(Duration::from_millis(50));
    }
    Some(Server {
        url,
        _shell: Some(child),
    })
}
