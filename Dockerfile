# Both base images are arguments, so that a mirror can replace them.
ARG BUILDER=docker.io/library/rust:1.95-slim-bookworm
ARG RUNTIME=gcr.io/distroless/cc-debian12:nonroot

FROM ${BUILDER} AS build
WORKDIR /src
# The dependencies are a separate layer, compiled for an empty program, so that a change in src does not build them again.
COPY Cargo.toml Cargo.lock ./
COPY src/contact/Cargo.toml src/contact/
COPY src/tables/Cargo.toml src/tables/
COPY src/jobs/Cargo.toml src/jobs/
COPY src/http/Cargo.toml src/http/
COPY src/macros src/macros
COPY benches/Cargo.toml benches/
RUN echo 'fn main() {}' > src/main.rs \
    && touch src/lib.rs src/contact/lib.rs src/tables/lib.rs src/jobs/lib.rs src/http/lib.rs \
    && cargo build --profile image --features cluster,otlp,gs,az --locked --bin railhead
COPY api ./api
COPY src ./src
# Copied files keep their dates, which may be older than those of the empty program. Touching them makes cargo build them.
# The profile `image` takes longer to build and gives a smaller program.
RUN touch src/main.rs src/lib.rs src/*/lib.rs \
    && cargo build --profile image --features cluster,otlp,gs,az --locked --bin railhead \
    && install -d /out/data \
    && install target/image/railhead /out

FROM ${RUNTIME}
LABEL org.opencontainers.image.title="railhead" \
      org.opencontainers.image.description="Rolling-contact stress service over HTTP" \
      org.opencontainers.image.licenses="MIT OR Apache-2.0"
COPY --from=build /out/railhead /usr/local/bin/railhead
COPY --from=build --chown=65532:65532 /out/data /data
# A running job has less time to end than the 10 s after which most container engines kill the process.
ENV RAILHEAD_LISTEN=0.0.0.0:8080 \
    RAILHEAD_DATA_DIR=/data \
    RAILHEAD_LOG_FORMAT=json \
    RAILHEAD_SHUTDOWN_GRACE_S=8
USER 65532:65532
VOLUME ["/data"]
EXPOSE 8080
# The image has no shell and no curl, so the program probes the address on which it listens itself.
HEALTHCHECK --interval=30s --timeout=5s --start-period=10s CMD ["/usr/local/bin/railhead", "healthcheck"]
ENTRYPOINT ["/usr/local/bin/railhead"]
CMD ["serve"]
