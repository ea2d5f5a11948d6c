//! Tests large results in the database: they are read back unchanged, whole and by range, and swept only if no job refers to them.

use bytes::Bytes;
use object_store::path::Path;
use object_store::{ObjectStoreExt, PutPayload};
use railhead::jobs::store::QueueBounds;

use crate::store::{StoreKind, Table, new_job, success};

#[tokio::test]
async fn an_object_is_read_back_by_any_range_and_is_gone_once_removed() {
    if crate::cluster::postgres::server().is_none() {
        return;
    }
    let table = Table::new(StoreKind::Postgres).await;
    let objects = table.store.cluster().expect("a shared store").objects();
    // The length is two and a half chunks.
    let body: Vec<u8> = (0..5_u32 << 19).map(|n| (n % 251) as u8).collect();
    let path = Path::from("results/2026/11/a/1/fields.bin");
    let payload = PutPayload::from_bytes(Bytes::from(body.clone()));
    objects.put(&path, payload.clone()).await.unwrap();
    objects.put(&path, payload).await.unwrap();
    let whole = objects.get(&path).await.unwrap().bytes().await.unwrap();
    assert!(whole == body);
    for range in [
        0..1,
        7..1 << 20,
        (1 << 20) - 1..(1 << 20) + 1,
        (2 << 20) + 5..body.len() as u64,
    ] {
        let part = objects.get_range(&path, range.clone()).await.unwrap();
        let from = usize::try_from(range.start).unwrap();
        assert!(
            part == body[from..usize::try_from(range.end).unwrap()],
            "{range:?}"
        );
    }
    let empty = Path::from("results/2026/12/b/1/solution.json");
    objects.put(&empty, PutPayload::new()).await.unwrap();
    assert_eq!(objects.head(&empty).await.unwrap().size, 0);
    objects.delete(&path).await.unwrap();
    let gone = objects.get(&path).await;
    assert!(matches!(gone, Err(object_store::Error::NotFound { .. })));
}

#[tokio::test]
async fn old_objects_are_swept_if_no_job_refers_to_them() {
    if crate::cluster::postgres::server().is_none() {
        return;
    }
    let table = Table::new(StoreKind::Postgres).await;
    let cluster = table.store.cluster().expect("a shared store");
    table
        .store
        .enqueue(&new_job(), QueueBounds::NONE)
        .await
        .unwrap();
    let claim = table.claim(0).await.unwrap();
    // The key of its result is `results/1`.
    table.finish(&claim, &success(), 1).await.unwrap();
    let objects = cluster.objects();
    let paths = [
        "results/1/solution.json",
        "results/2/solution.json",
        "results/3/solution.json",
    ];
    for path in paths {
        let payload = PutPayload::from_static(b"{}");
        objects.put(&Path::from(path), payload).await.unwrap();
    }
    let pool = sqlx::PgPool::connect(table.url.as_deref().unwrap())
        .await
        .unwrap();
    let age = "UPDATE objects SET made_at = 0 WHERE path <> 'results/3/solution.json'";
    sqlx::query(age).execute(&pool).await.unwrap();
    assert_eq!(cluster.sweep_objects().await.unwrap(), 1);
    let left: Vec<String> = sqlx::query_scalar("SELECT path FROM objects ORDER BY path")
        .fetch_all(&pool)
        .await
        .unwrap();
    assert_eq!(left, [paths[0], paths[2]]);
}
