# The harness with all it can use without a robot: twin, firmware tools, simavr. From a clean clone:
#   docker build -t skid-steer-hil .
#   docker run --rm -v "$PWD:/work" skid-steer-hil experiment --camera pose
FROM python:3.12-bookworm AS tools
SHELL ["/bin/bash", "-o", "pipefail", "-c"]
COPY .ci/debian-packages /tmp/debian-packages
# The versions are those of the Debian release that the image names.
# hadolint ignore=DL3008
RUN apt-get update \
    && grep -v '^#' /tmp/debian-packages | xargs apt-get install -y --no-install-recommends \
    && rm -rf /var/lib/apt/lists/* /tmp/debian-packages

FROM tools
COPY . /opt/skid-steer-hil
WORKDIR /opt/skid-steer-hil
# Records name the revision of the harness, also where another user than the image's runs it.
RUN git config --system --add safe.directory /opt/skid-steer-hil
RUN .ci/setup && rm -rf /root/.cache/pip
ENV PATH="/opt/skid-steer-hil/.venv/bin:$PATH" MPLCONFIGDIR=/tmp/matplotlib
RUN hil --version
WORKDIR /work
ENTRYPOINT ["hil"]
CMD ["--help"]
