# Runs the two commands of the README on a software adapter:
#   docker build -t raystone .                     runs scripts/bench
#   docker run --rm raystone scripts/test          runs all tests
#   docker run --rm raystone raystone doctor
FROM rust:1.95-bookworm
WORKDIR /raystone
COPY . .
# The driver of the backports is twice as fast and runs long loops to their end.
RUN scripts/install-driver --backports && rm -rf /var/lib/apt/lists/*
RUN scripts/bench && install target/release/raystone /usr/local/bin/
CMD ["raystone", "doctor"]
