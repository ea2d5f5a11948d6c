//! A service that requires keys.

use std::collections::BTreeMap;

use railhead::jobs::Options;
use railhead::jobs::keys::Keyring;
use reqwest::{Body, Method, RequestBuilder};
use serde_json::Value;

use crate::server::{Answer, Server, Setup};

/// A service that requires keys, with keys of two tenants and of the operator, and one key that is bound to a label.
pub struct Guarded {
    pub server: Server,
    pub north: String,
    pub south: String,
    pub operator: String,
    /// A key of the tenant `north` that is bound to `line:7`.
    pub line_7: String,
}

impl Guarded {
    pub async fn start(mut setup: Setup, change: impl FnOnce(&mut Options)) -> Guarded {
        change(&mut setup.options);
        setup.http.anonymous = false;
        let keys = Keyring::open(&setup.options.data_dir).await.unwrap();
        let make = async |tenant: &str| {
            keys.create(tenant, None, false, BTreeMap::new())
                .await
                .unwrap()
                .1
        };
        let (north, south) = (make("north").await, make("south").await);
        let operator = make("operator").await;
        let labels = BTreeMap::from([("line".to_owned(), "7".to_owned())]);
        let (_, line_7) = keys.create("north", None, false, labels).await.unwrap();
        let server = setup.start().await;
        Guarded {
            server,
            north,
            south,
            operator,
            line_7,
        }
    }

    pub async fn send(
        &self,
        key: &str,
        method: Method,
        path: &str,
        body: Option<&Value>,
    ) -> Answer {
        let shape = |request: RequestBuilder| {
            let request = request.bearer_auth(key);
            match body {
                Some(body) => request.json(body),
                None => request,
            }
        };
        self.server.send(method, path, shape).await
    }

    pub async fn post(&self, key: &str, path: &str, body: &Value) -> Answer {
        self.send(key, Method::POST, path, Some(body)).await
    }

    /// Sends a body with this media type.
    pub async fn post_as(
        &self,
        key: &str,
        path: &str,
        form: &str,
        body: impl Into<Body>,
    ) -> Answer {
        let shape = |request: RequestBuilder| {
            let request = request.bearer_auth(key).header("content-type", form);
            request.body(body)
        };
        self.server.send(Method::POST, path, shape).await
    }

    pub async fn cancel(&self, key: &str, path: &str) -> Answer {
        let path = format!("{path}/cancel");
        self.send(key, Method::POST, &path, None).await
    }

    pub async fn get(&self, key: &str, path: &str) -> Answer {
        self.send(key, Method::GET, path, None).await
    }

    pub async fn submit(&self, key: &str, case: &Value) -> String {
        let answer = self.send(key, Method::POST, "/v1/jobs", Some(case)).await;
        answer.is(202).location()
    }

    pub async fn until_ended(&self, key: &str, path: &str) -> Value {
        let ended = self.get(key, &format!("{path}?wait=600")).await.is(200);
        assert!(ended.json["ended_at"].is_string(), "{}", ended.text);
        ended.json
    }
}
