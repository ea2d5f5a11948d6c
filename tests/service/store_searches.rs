//! Tests searches for jobs and batches by states, labels and names, and notification of their changes.

use railhead::jobs::State;
use railhead::jobs::model::Kind;
use railhead::jobs::store::{Change, Filter, Membership, NewBatch, NewJob, Total, Usage};
use uuid::Uuid;

use crate::store::*;

conformance!(
    several_states_labels_and_words_of_the_name_are_found_page_by_page,
    a_search_that_finds_little_ends_its_page_and_goes_on_from_there,
    changes_are_told_in_their_order_once_and_to_their_tenant_alone,
    jobs_submitted_alone_are_listed_without_those_of_batches,
    batches_are_listed_with_their_counts_and_found_by_name_and_label,
);

/// Creates twelve jobs with names and labels. Jobs 0 to 3 have ended and job 4 is running.
async fn twelve(table: &Table) -> Vec<Uuid> {
    let mut ids = Vec::new();
    for number in 0..12 {
        let labels = [("even", number % 2 == 0), ("third", number % 3 == 0)];
        let labels = labels.into_iter().filter(|(_, carried)| *carried);
        let new = NewJob {
            name: Some(format!("Case {number} on the CROWN")),
            labels: labels
                .map(|(key, _)| (key.to_owned(), "yes".to_owned()))
                .collect(),
            ..new_job()
        };
        ids.push(table.add(new).await.id);
    }
    for place in 0..5 {
        let claim = table.claim(1_000).await.unwrap();
        assert_eq!(claim.id, ids[place]);
        let ending = [success(), failure()][place % 2].clone();
        if place < 4 {
            table.finish(&claim, &ending, 2_000).await.unwrap();
        }
    }
    ids
}

/// Reads a list page by page. Returns the indices of the jobs found and the total.
async fn pages(table: &Table, ids: &[Uuid], filter: &Filter) -> (Vec<usize>, Total) {
    let (mut found, mut after, mut total) = (Vec::new(), None, None);
    loop {
        let page = table.list(filter, after, 2).await;
        assert!(page.entries.len() <= 2);
        for job in &page.entries {
            assert_eq!(job.batch_id, None);
            found.push(ids.iter().position(|id| *id == job.id).unwrap());
        }
        total = total.or(Some(page.total));
        match page.next_cursor {
            Some(cursor) => after = filter.read_cursor(&cursor),
            None => return (found, total.unwrap()),
        }
    }
}

async fn several_states_labels_and_words_of_the_name_are_found_page_by_page(kind: StoreKind) {
    let table = Table::new(kind).await;
    let ids = twelve(&table).await;
    let found = async |filter: &Filter| pages(&table, &ids, filter).await;
    let states = |states: &[State]| Filter {
        states: states.to_vec(),
        ..Filter::default()
    };
    let (jobs, total) = found(&states(&[State::Running, State::Failed])).await;
    assert_eq!((jobs, total), (vec![4, 3, 1], Total::Exactly(3)));
    let (jobs, total) = found(&states(&[State::Queued, State::Succeeded])).await;
    assert_eq!(
        (jobs, total),
        (vec![11, 10, 9, 8, 7, 6, 5, 2, 0], Total::Exactly(9))
    );
    assert_eq!(found(&states(&State::ALL)).await.1, Total::Exactly(12));
    let label = |key: &str| (key.to_owned(), "yes".to_owned());
    let labels = |labels: Vec<(String, String)>| Filter {
        labels,
        ..Filter::default()
    };
    assert_eq!(
        found(&labels(vec![label("even")])).await.1,
        Total::Exactly(6)
    );
    assert_eq!(
        found(&labels(vec![label("even"), label("third")])).await.0,
        [6, 0]
    );
    let mut named = Filter {
        name: Some("case 1".to_owned()),
        ..Filter::default()
    };
    assert_eq!(found(&named).await.0, [11, 10, 1]);
    named.states = vec![State::Failed, State::Queued];
    assert_eq!(found(&named).await.0, [11, 10, 1]);
    named.name = Some("crown".to_owned());
    named.labels = vec![label("third")];
    assert_eq!(found(&named).await.0, [9, 6, 3]);
}

async fn a_search_that_finds_little_ends_its_page_and_goes_on_from_there(kind: StoreKind) {
    let table = Table::new(kind).await;
    let wanted = NewJob {
        name: Some("the needle".to_owned()),
        ..new_job()
    };
    let wanted = table.add(wanted).await.id;
    let batch = new_batch("anonymous", 20_500);
    let jobs = (0..20_500).map(|_| new_job());
    begin(&*table.store, &batch, jobs).await;
    for states in [vec![], vec![State::Queued, State::Failed]] {
        let filter = Filter {
            name: Some("needle".to_owned()),
            states,
            ..Filter::default()
        };
        let list = async |after| table.list(&filter, after, 50).await;
        let first = list(None).await;
        assert!(first.entries.is_empty() && first.next_cursor.is_some());
        let second = list(filter.read_cursor(&first.next_cursor.unwrap())).await;
        assert_eq!(ids(&second.entries), [wanted]);
        assert_eq!(second.next_cursor, None);
    }
    let all = Filter {
        member: Some(Membership::Batch(batch.id)),
        ..Filter::default()
    };
    let page = table.list(&all, None, 1).await;
    assert_eq!(page.total, Total::AtLeast(1_000));
}

async fn jobs_submitted_alone_are_listed_without_those_of_batches(kind: StoreKind) {
    let table = Table::new(kind).await;
    let ids = twelve(&table).await;
    four_batches(&table).await;
    let found = async |filter: &Filter| pages(&table, &ids, filter).await;
    let mut alone = Filter {
        member: Some(Membership::Alone),
        ..Filter::default()
    };
    let (jobs, total) = found(&alone).await;
    assert_eq!((jobs, total), ((0..12).rev().collect(), Total::Exactly(12)));
    alone.name = Some("case 1".to_owned());
    assert_eq!(found(&alone).await.0, [11, 10, 1]);
    alone.name = None;
    alone.states = vec![State::Queued];
    assert_eq!(found(&alone).await.1, Total::Exactly(6));
    alone.labels = vec![("third".to_owned(), "yes".to_owned())];
    assert_eq!(found(&alone).await.0, [9, 6]);
}

async fn changes_are_told_in_their_order_once_and_to_their_tenant_alone(kind: StoreKind) {
    let table = Table::new(kind).await;
    let store = &table.store;
    let mut ids = Vec::new();
    for _ in 0..3 {
        let new = NewJob {
            created_at: 10,
            ..new_job()
        };
        ids.push(table.add(new).await.id);
    }
    let told = async |since, after| {
        let changes = store.changes("anonymous", since, after, 2).await.unwrap();
        let place = |change: &Change| {
            (
                ids.iter().position(|id| *id == change.id).unwrap(),
                change.at,
            )
        };
        changes.iter().map(place).collect::<Vec<_>>()
    };
    assert_eq!(told(9, None).await, [(0, 10), (1, 10)]);
    assert_eq!(told(10, Some(ids[1])).await, [(2, 10)]);
    let claim = table.claim(20).await.unwrap();
    assert_eq!(told(10, Some(ids[2])).await, [(0, 20)]);
    assert_eq!(table.release(&claim, 30).await, Some(State::Queued));
    assert_eq!(told(20, None).await, [(0, 30)]);
    store.cancel("anonymous", ids[1], 40).await.unwrap();
    assert_eq!(told(30, Some(ids[2])).await, [(1, 40)]);
    let claim = table.claim(50).await.unwrap();
    table.finish(&claim, &success(), 60).await.unwrap();
    assert_eq!(told(30, Some(ids[2])).await, [(1, 40), (0, 60)]);
    assert_eq!(table.job(ids[0]).await.unwrap().updated_at, 60);
    assert_eq!(store.changes("other", 0, None, 9).await.unwrap(), []);
}

/// Creates four batches of two jobs. The last batch is never acknowledged, and one job of the first has succeeded.
async fn four_batches(table: &Table) -> Vec<Uuid> {
    let store = &table.store;
    let mut ids = Vec::new();
    for (number, name) in ["Plan A", "plan b", "other", "unfinished"]
        .into_iter()
        .enumerate()
    {
        let new = NewBatch {
            name: Some(name.to_owned()),
            labels: [("part".to_owned(), (number % 2).to_string())].into(),
            ..new_batch("anonymous", 2)
        };
        begin(&**store, &new, [new_job(), new_job()]).await;
        if name != "unfinished" {
            store.complete_batch(new.id).await.unwrap();
        }
        ids.push(new.id);
    }
    let claim = table.claim(7).await.unwrap();
    table.finish(&claim, &success(), 8).await.unwrap();
    ids
}

async fn batches_are_listed_with_their_counts_and_found_by_name_and_label(kind: StoreKind) {
    let table = Table::new(kind).await;
    let store = &table.store;
    let ids = four_batches(&table).await;
    let list = async |filter: &Filter, after, limit| {
        let page = store
            .batches("anonymous", filter, after, limit)
            .await
            .unwrap();
        let places = page
            .entries
            .iter()
            .map(|batch| ids.iter().position(|id| *id == batch.id).unwrap());
        (places.collect::<Vec<_>>(), page)
    };
    let all = Filter::of(Kind::Cases);
    let (first, page) = list(&all, None, 2).await;
    assert_eq!((first, page.total), (vec![2, 1], Total::Exactly(3)));
    let after = all.read_cursor(&page.next_cursor.unwrap());
    let (rest, page) = list(&all, after, 2).await;
    assert_eq!((rest, page.next_cursor), (vec![0], None));
    let batch = &page.entries[0];
    assert_eq!((batch.ended(), batch.last_ended_at), ((1, 2), Some(8)));
    assert_eq!(
        (batch.name.as_deref(), batch.labels["part"].as_str()),
        (Some("Plan A"), "0")
    );
    let alone = store.batch("anonymous", Kind::Cases, ids[0]).await.unwrap();
    assert_eq!(alone.as_ref(), Some(batch));
    let named = Filter {
        name: Some("PLAN".to_owned()),
        ..Filter::of(Kind::Cases)
    };
    assert_eq!(list(&named, None, 9).await.0, [1, 0]);
    let labelled = Filter {
        labels: vec![("part".to_owned(), "0".to_owned())],
        ..Filter::of(Kind::Cases)
    };
    assert_eq!(list(&labelled, None, 9).await.0, [2, 0]);
    let others = store.batches("other", &all, None, 9).await.unwrap();
    assert!(others.entries.is_empty());
    let usage = store.usage("anonymous").await.unwrap();
    assert_eq!(
        (usage.jobs[&State::Queued], usage.jobs[&State::Succeeded]),
        (7, 1)
    );
    assert_eq!(store.usage("other").await.unwrap(), Usage::default());
}
