# gradedesign with the plugins of gradedesign[all], from this folder:
#   docker build --tag gradedesign .
#   docker run --rm --volume "$PWD:/work" gradedesign run cases/bracket
FROM python:3.13-slim AS wheels
COPY . /project
WORKDIR /project
RUN pip wheel --no-cache-dir --no-deps --wheel-dir /wheels . ./plugins/*/

FROM python:3.13-slim
# Threads of compiled kernels run by OpenMP where the system has it.
RUN apt-get update && apt-get install --yes --no-install-recommends libgomp1 \
    && rm -rf /var/lib/apt/lists/*
RUN --mount=type=bind,from=wheels,source=/wheels,target=/wheels \
    pip install --no-cache-dir --find-links /wheels 'gradedesign[all]'
RUN useradd --create-home user
USER user
WORKDIR /work
ENTRYPOINT ["gradedesign"]
