# syntax=docker/dockerfile:1
# Both bases are arguments, so that a mirror or a stand-in can be put in their place.
ARG BUILDER=docker.io/library/rust:1.95-slim-bookworm
ARG RUNTIME=gcr.io/distroless/cc-debian12:nonroot

FROM ${BUILDER} AS build
WORKDIR /src
COPY Cargo.toml Cargo.lock ./
COPY src ./src
COPY api ./api
COPY benches ./benches
RUN cargo build --release --locked --bin railhead \
    && install -d -o 65532 -g 65532 /out/data \
    && install -m 0755 target/release/railhead /out/railhead

FROM ${RUNTIME}
COPY --from=build /out/railhead /usr/local/bin/railhead
COPY --from=build --chown=65532:65532 /out/data /data
ENV RAILHEAD_LISTEN=0.0.0.0:8080 \
    RAILHEAD_DATA_DIR=/data \
    RAILHEAD_LOG_FORMAT=json
USER 65532:65532
VOLUME ["/data"]
EXPOSE 8080
# The image has no shell and no curl: the program asks itself.
HEALTHCHECK --interval=30s --timeout=5s --start-period=10s CMD ["/usr/local/bin/railhead", "healthcheck", "--url", "http://127.0.0.1:8080/readyz"]
ENTRYPOINT ["/usr/local/bin/railhead"]
CMD ["serve"]
